"""Messages of each encoding: `decoders` says which type reads which, one file each; `encoding` writes
ROS 2's.

`fields` names the numbers within a message, `layout` finds them in many messages at once.
"""
