"""Is a part of one body inside another? Exact parity of rays, asked of closed meshes; and where rays meet a mesh."""
