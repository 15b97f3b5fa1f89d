"""Is one body wholly inside another? Exact parity of rays, asked only of closed meshes."""
