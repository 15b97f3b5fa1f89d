"""From a session to bodies, one motion and pairs: policy, repair, interpolation, kinematics, pair choice."""
