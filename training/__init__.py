"""Training of the denoiser: procedural stages, data sets rendered from them, the network.

Works in a checkout, see python/mbfeat/docs/training.md. Only `training.model` and the commands that
train, evaluate and export import torch.
"""
