"""From beams and routes to MuJoCo: chains of links, tendons, scenes."""
