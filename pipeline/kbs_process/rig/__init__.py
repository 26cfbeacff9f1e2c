"""The rig as data: transducer, bodies, joints and drives, every number with its uncertainty."""
