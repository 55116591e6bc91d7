"""Kernels on a device, each the twin of a NumPy reference."""
