"""The sample-based kernel-splatting network (SKSN) and what is built on it, in PyTorch.

After Gharbi, Li, Aittala, Lehtinen and Durand, "Sample-based Monte Carlo Denoising using a
Kernel-Splatting Network", ACM Transactions on Graphics 38(4), 2019.

| module | holds |
|---|---|
| `config` | the switches and sizes of a network |
| `inputs` | feature sets: which channels of a path sample a network is given, in which order |
| `encoding` | what the network makes of these channels before its first layer |
| `blocks` | pointwise networks and the U-Net |
| `splat` | kernel splatting with a running maximum, and its twin of plain operators |
| `pyramid` | small kernels on several scales |
| `sksn` | the network |
| `losses` | training losses |
"""
