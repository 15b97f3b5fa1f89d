using System.Collections.Generic;
using System.IO;
using System.Text;
using UnityEngine;
using static System.FormattableString;

public class VrLabColliders : MonoBehaviour
{
    public string file = "colliders.glb";
    readonly List<string> nodes = new(), meshes = new(), accessors = new(), views = new();
    MemoryStream data;

    [ContextMenu("Write colliders")]
    void WriteColliders()
    {
        nodes.Clear(); meshes.Clear(); accessors.Clear(); views.Clear(); data = new MemoryStream();
        foreach (var body in GetComponent<VrLabRecorder>().bodies)
        {
            int number = 0;
            foreach (var one in body.GetComponentsInChildren<Collider>())
                if (!one.isTrigger) Add(body, one, number++);
        }
        string Rows(string name, List<string> rows) => $"\"{name}\":[{string.Join(",", rows)}]";
        string json = "{\"asset\":{\"version\":\"2.0\"}," + string.Join(",", Rows("nodes", nodes), Rows("meshes", meshes),
            Rows("accessors", accessors), Rows("bufferViews", views)) + Invariant($",\"buffers\":[{{\"byteLength\":{data.Length}}}]}}");
        while (Encoding.UTF8.GetByteCount(json) % 4 != 0) json += " ";
        byte[] text = Encoding.UTF8.GetBytes(json);
        using var writer = new BinaryWriter(File.Create(Path.Combine(Application.persistentDataPath, file)));
        writer.Write(0x46546C67); writer.Write(2); writer.Write(28 + text.Length + (int)data.Length);
        writer.Write(text.Length); writer.Write(0x4E4F534A); writer.Write(text);
        writer.Write((int)data.Length); writer.Write(0x004E4942); writer.Write(data.ToArray());
    }

    void Add(Transform body, Collider one, int number)
    {
        var (points, faces, kind) = Shape(one);
        if (points == null) return;
        int first = accessors.Count, start = (int)data.Length;
        var writer = new BinaryWriter(data);
        foreach (Vector3 point in points)
        {
            Vector3 p = Quaternion.Inverse(body.rotation) * (one.transform.TransformPoint(point) - body.position);
            writer.Write(p.x); writer.Write(p.y); writer.Write(-p.z);   // right-handed, as the recording
        }
        int middle = (int)data.Length;
        for (int k = 0; k < faces.Length; k += 3)
        {
            writer.Write(faces[k]); writer.Write(faces[k + 2]); writer.Write(faces[k + 1]);
        }
        views.Add(Invariant($"{{\"buffer\":0,\"byteOffset\":{start},\"byteLength\":{middle - start}}}"));
        views.Add(Invariant($"{{\"buffer\":0,\"byteOffset\":{middle},\"byteLength\":{data.Length - middle}}}"));
        accessors.Add(Invariant($"{{\"bufferView\":{first},\"componentType\":5126,\"count\":{points.Length},\"type\":\"VEC3\"}}"));
        accessors.Add(Invariant($"{{\"bufferView\":{first + 1},\"componentType\":5125,\"count\":{faces.Length},\"type\":\"SCALAR\"}}"));
        meshes.Add(Invariant($"{{\"primitives\":[{{\"attributes\":{{\"POSITION\":{first}}},\"indices\":{first + 1}}}]}}"));
        string name = body.name.Replace('"', ' ').Replace('\\', ' ');
        nodes.Add(Invariant($"{{\"name\":\"{kind}_{name}_{number:D2}\",\"mesh\":{meshes.Count - 1}}}"));
    }

    static (Vector3[], int[], string) Shape(Collider one)
    {
        switch (one)
        {
            case BoxCollider box:
                return Moved(PrimitiveType.Cube, box.center, box.size, "UBX");
            case SphereCollider ball:
                return Moved(PrimitiveType.Sphere, ball.center, Vector3.one * (2 * ball.radius), "USP");
            case CapsuleCollider pill:   // Unity's own is 2 high and 1 wide, along Y
                var (points, faces, kind) = Moved(PrimitiveType.Capsule, Vector3.zero, Vector3.one, "UCP");
                float half = Mathf.Max(0, pill.height / 2 - pill.radius);
                for (int k = 0; k < points.Length; k++)
                {
                    float end = points[k].y > 0 ? 0.5f : -0.5f;
                    Vector3 p = new Vector3(points[k].x, points[k].y - end, points[k].z) * (2 * pill.radius);
                    p.y += 2 * end * half;
                    if (pill.direction == 0) p = new Vector3(p.y, p.x, p.z);
                    if (pill.direction == 2) p = new Vector3(p.x, p.z, p.y);
                    points[k] = pill.center + p;
                }
                return (points, faces, kind);
            case MeshCollider mesh when mesh.sharedMesh != null:
                return (mesh.sharedMesh.vertices, mesh.sharedMesh.triangles, mesh.convex ? "UCX" : "UTM");
            default:
                return (null, null, null);
        }
    }

    static (Vector3[], int[], string) Moved(PrimitiveType type, Vector3 center, Vector3 size, string kind)
    {
        var made = GameObject.CreatePrimitive(type);
        made.SetActive(false);
        var mesh = made.GetComponent<MeshFilter>().sharedMesh;
        var points = System.Array.ConvertAll(mesh.vertices, p => center + Vector3.Scale(p, size));
        Destroy(made);
        return (points, mesh.triangles, kind);
    }
}
