"""A fleet world without pixels: drones as points that fly bases, judged by where they truly are."""
