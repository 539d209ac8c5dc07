# The extension module documents itself; its types are not checked here.
from typing import Any

def __getattr__(name: str) -> Any: ...
