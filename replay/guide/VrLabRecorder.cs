using System.IO;
using UnityEngine;
using UnityEngine.XR;
using static System.FormattableString;   // numbers with a point in every country

public class VrLabRecorder : MonoBehaviour
{
    public Transform[] bodies;
    public string file = "session.csv";
    StreamWriter writer;

    void Awake()
    {
        writer = new StreamWriter(Path.Combine(Application.persistentDataPath, file));
        writer.WriteLine("kind,time,body,px,py,pz,qx,qy,qz,qw,tracked,other,value");
        foreach (var body in bodies)
            body.gameObject.AddComponent<VrLabContacts>().recorder = this;
        InvokeRepeating(nameof(Flush), 1f, 1f);   // a crash costs a second at most
    }

    void LateUpdate()
    {
        foreach (var body in bodies)
        {
            Vector3 p = body.position; Quaternion q = body.rotation;
            Write(Invariant($"pose,{Time.timeAsDouble:F6},{Cell(body.name)},{p.x:R},{p.y:R},{p.z:R},{q.x:R},{q.y:R},{q.z:R},{q.w:R},{Tracked(body)},,"));
        }
        Trigger("left", XRNode.LeftHand);
        Trigger("right", XRNode.RightHand);
    }

    void Trigger(string hand, XRNode node)
    {
        if (InputDevices.GetDeviceAtXRNode(node).TryGetFeatureValue(CommonUsages.trigger, out float value))
            Write(Invariant($"trigger,{Time.timeAsDouble:F6},{hand},,,,,,,,,,{value:R}"));
    }

    int Tracked(Transform body)   // name the controllers with "left" and "right" in them
    {
        string name = body.name.ToLowerInvariant();
        XRNode node = name.Contains("left") ? XRNode.LeftHand : XRNode.RightHand;
        bool hand = name.Contains("left") || name.Contains("right");
        return hand && InputDevices.GetDeviceAtXRNode(node).TryGetFeatureValue(CommonUsages.isTracked, out bool ok) && !ok ? 0 : 1;
    }

    public void Contact(string kind, string body, string other) =>
        Write(Invariant($"{kind},{Time.timeAsDouble:F6},{Cell(body)},,,,,,,,,{Cell(other)},"));

    public void Scalar(string name, float value) =>   // such as a heart rate
        Write(Invariant($"scalar,{Time.timeAsDouble:F6},,,,,,,,,,{Cell(name)},{value:R}"));

    static string Cell(string name) => name.Replace(',', ' ').Replace('"', ' ');
    void Write(string line) => writer?.WriteLine(line);
    void Flush() => writer?.Flush();
    void OnDestroy() { writer?.Dispose(); writer = null; }
}

public class VrLabContacts : MonoBehaviour
{
    public VrLabRecorder recorder;
    void OnCollisionEnter(Collision hit) => recorder.Contact("enter", name, hit.gameObject.name);
    void OnCollisionExit(Collision hit) => recorder.Contact("exit", name, hit.gameObject.name);
}
