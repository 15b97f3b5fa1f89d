"""Physics and chemistry as functions of numbers: nothing here knows a session, an effect or a picture."""
