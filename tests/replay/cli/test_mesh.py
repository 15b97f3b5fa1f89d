from support.small_worlds import cube

from replay.cli.main import main
from sessions.meshes.glb import mesh_to_glb
from sessions.meshes.glb_tree import read_glb


def test_mended_mesh_is_named_after_its_file_or_as_requested(tmp_path):
    """cup.glb, whose mesh is called x, is mended into m.glb: its mesh is called m, or as ``--body`` says."""
    file, out = tmp_path / "cup.glb", tmp_path / "m.glb"
    file.write_bytes(mesh_to_glb(cube(), "x"))
    assert main(["mesh", "repair", str(file), "-o", str(out)]) == 0
    assert read_glb(out.read_bytes()).owners == ("m",)
    assert main(["mesh", "repair", str(file), "-o", str(out), "--body", "flask", "--force"]) == 0
    assert read_glb(out.read_bytes()).owners == ("flask",)
