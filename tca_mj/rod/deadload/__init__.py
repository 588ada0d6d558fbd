"""A fibre of any reference shape under heat and a dead load at its free end."""
