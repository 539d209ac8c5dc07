"""``mbfeat effects``: what a stage calls for, who asks for it, and what each effect costs."""
