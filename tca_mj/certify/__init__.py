"""How far the chain of every module is from the theory of rods, computed anew by one command."""
