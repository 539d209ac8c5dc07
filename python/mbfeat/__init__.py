"""MBFeat: a path tracing Hydra delegate that records multi-bounce path features.

The renderer itself is the extension module ``mbfeat._core``; this package is its Python face:
the command line, the recorder, and tools for feature images.
"""

from pkgutil import extend_path

# In a checkout the extension module lies in the build folder, which ./run puts on PYTHONPATH.
__path__ = extend_path(__path__, __name__)
__version__ = "0.1.0"
