"""Is a part of one body inside another? Exact parity of rays, asked only of closed meshes."""
