"""Balance of the sections of soft bodies in series, by collocation and multiple shooting."""
