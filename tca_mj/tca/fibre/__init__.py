"""The twisted fibre itself: any reference shape, and its shape under heat and load."""
