"""``mbfeat tradeoff``: what accuracy costs in time, measured on any stage with a camera.

| module | holds |
|---|---|
| `options`, `request` | the command line, and what it asks for |
| `command`, `outcome` | the command; the values, files and text that it leaves |
| `variants` | ways to an image, as data: raw, installed denoise models, Open Image Denoise, peers |
| `inspection` | what of a stage the measurement needs to know; runs in a process of its own |
| `child`, `renders` | a render by usdrecord in a process of its own, and what starts it |
| `exr` | reading images back |
| `filters`, `filter_worker` | Open Image Denoise in a process of its own |
| `peers` | other renderers, in a checkout |
| `kept` | finished renders in the output folder, from which an interrupted run goes on |
| `reference` | the image that errors are against, and its own noise |
| `measure` | the ladder of samples, variants and seeds |
| `analysis` | medians and ranges, the Pareto front, the two answers |
| `charts`, `crops`, `web`, `page`, `wording` | what is shown |
"""
