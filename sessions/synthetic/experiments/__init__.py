"""Nine experiments of an inorganic chemistry course as scripts of a student's procedure; nothing is imported here."""
