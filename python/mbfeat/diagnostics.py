"""Messages of OpenUSD and of our own, as one sentence each on stderr."""

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


class OpenUsdMessages:
    """Collects OpenUSD's own warnings while it lives, to print them without source positions.

    MBFeat's messages do not come this way: Host.print_messages shows them at once.
    """

    # The recorder says this whenever the settings prim has no products, as the command allows.
    IGNORED = ("No Render Prouducts found", "No Render Products found")
    # And this of every product whose file is there, were it an old one of a product that was not
    # written. The summary names the files that were.
    IGNORED_STATUS = "generated from RenderProduct prim"

    def __init__(self) -> None:
        from pxr import UsdUtils

        self._delegate: Any = UsdUtils.CoalescingDiagnosticDelegate()
        self._printed: set[str] = set()

    def flush(self) -> None:
        """Prints what came since the last call; the same text only once."""
        for item in self._delegate.TakeUncoalescedDiagnostics():
            text = item.commentary.strip()
            status = "STATUS" in item.diagnosticCodeString
            if text in self._printed or text.startswith(self.IGNORED):
                continue
            if status and self.IGNORED_STATUS in text:
                continue
            self._printed.add(text)
            complain(text if status else f"warning: {text}")
