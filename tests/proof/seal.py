"""Seals: what is concealed in a trial, readable by nobody until the score breaks the seal.

A seal is made with a public key and broken with the private one, so that no process which makes a trial, on this
machine or another, can read a seal, not even its own. X25519 with a key pair of its own for each seal, HKDF-SHA-256,
AES-256-GCM. The text is padded, so that the seal's size says nothing.
"""

from __future__ import annotations

import hashlib
import os

from cryptography.exceptions import InvalidTag
from cryptography.hazmat.primitives.asymmetric.x25519 import X25519PrivateKey, X25519PublicKey
from cryptography.hazmat.primitives.ciphers.aead import AESGCM
from cryptography.hazmat.primitives.hashes import SHA256
from cryptography.hazmat.primitives.kdf.hkdf import HKDF

SIZE = 32768  # bytes of text in every seal
_LENGTH = 4  # bytes that say how many of them are not padding
_KEY = 32
_PURPOSE = b"kbs-process proof bench, seal 1"
_NONCE = bytes(12)  # each seal's key is used once


class SealError(Exception):
    """A seal that is not what it should be."""


def new_key() -> bytes:
    """Return a new private key, from the system's entropy."""
    return X25519PrivateKey.generate().private_bytes_raw()


def public(key: bytes) -> bytes:
    """Return the public key of a private one."""
    return X25519PrivateKey.from_private_bytes(key).public_key().public_bytes_raw()


def seal(text: bytes, public_key: bytes, trial: str) -> bytes:
    """Return `text` sealed for the holder of the private key; it opens for this trial's name alone."""
    if len(text) + _LENGTH > SIZE:
        raise SealError(f"{len(text)} bytes do not fit into a seal of {SIZE}")
    padded = len(text).to_bytes(_LENGTH, "big") + text + bytes(SIZE - _LENGTH - len(text))
    own = X25519PrivateKey.generate()
    shared = own.exchange(X25519PublicKey.from_public_bytes(public_key))
    sender = own.public_key().public_bytes_raw()
    return sender + AESGCM(_derived(shared, sender, public_key)).encrypt(_NONCE, padded, trial.encode())


def unseal(sealed: bytes, key: bytes, trial: str) -> bytes:
    """Return what was sealed, or raise SealError if seal, key and trial do not belong together."""
    sender, cipher = sealed[:_KEY], sealed[_KEY:]
    try:
        shared = X25519PrivateKey.from_private_bytes(key).exchange(X25519PublicKey.from_public_bytes(sender))
        padded = AESGCM(_derived(shared, sender, public(key))).decrypt(_NONCE, cipher, trial.encode())
    except (InvalidTag, ValueError) as error:
        raise SealError(f"the seal of {trial} is broken, of another trial, or made for another key") from error
    end = _LENGTH + int.from_bytes(padded[:_LENGTH], "big")
    return padded[_LENGTH:end]


def digest(content: bytes) -> str:
    """SHA-256, hexadecimal: of a seal, to be published with the trial; of an answer, before seals are broken."""
    return hashlib.sha256(content).hexdigest()


def random_name() -> str:
    """A trial's name, which says nothing."""
    return f"T{int.from_bytes(os.urandom(5), 'big'):010X}"


def _derived(shared: bytes, sender: bytes, receiver: bytes) -> bytes:
    return HKDF(SHA256(), _KEY, salt=None, info=_PURPOSE + sender + receiver).derive(shared)
