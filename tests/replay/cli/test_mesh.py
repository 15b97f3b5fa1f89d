from support.small_worlds import cube

from replay.cli.main import main
from sessions.meshes.glb import mesh_to_glb
from sessions.meshes.glb_tree import read_glb


def test_mended_mesh_is_named_after_its_file_or_as_requested(tmp_path):
    """By the file that is written, m.glb, and by ``--body``, not by the one that is read."""
    file, out = tmp_path / "cup.glb", tmp_path / "m.glb"
    file.write_bytes(mesh_to_glb(cube(), "x"))
    for text, name in (((), "m"), (("--body", "flask", "--force"), "flask")):
        assert main(["mesh", "repair", str(file), "-o", str(out), *text]) == 0
        assert read_glb(out.read_bytes()).owners == (name,)
