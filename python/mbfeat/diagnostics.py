"""Texts of errors that OpenUSD raises in Python, and the place for our own."""

from __future__ import annotations

import sys
from typing import Any


def tf_messages(error: Any) -> list[str]:
    """The texts of a Tf.ErrorException, each once, without source files and line numbers."""
    texts = [str(getattr(part, "commentary", part)).strip() for part in error.args]
    return list(dict.fromkeys(text for text in texts if text))


def complain(text: str) -> None:
    """One message of usdrecord on stderr."""
    sys.stderr.write(f"usdrecord: {text}\n")
    sys.stderr.flush()
