"""Comparison of ways to reconstruct an image from its samples.

| module | does |
|---|---|
| `methods` | the raw mean, Open Image Denoise |
| `networks` | our networks: exported ones as the renderer runs them, others by PyTorch |
| `auxiliary` | first-hit and first non-delta features of a pixel |
| `data` | the windows to compare on, rendered from seeds; `references/` has their references |
| `statistics` | means by group, ratios and bootstrap intervals |
| `report` | the table, JSON, and the sheet of crops |
| `page` | the documentation's page of a result |
"""
