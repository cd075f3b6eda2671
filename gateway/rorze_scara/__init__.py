"""SCARA robots: two or three bodies of one line whose axes move together (RC-420 manual 13.10)."""
