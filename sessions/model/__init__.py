"""The model of a session: frames, tracks, scene, events, hands, live contacts."""
