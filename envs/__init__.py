"""Gymnasium tasks, imported as ``tca_mj.envs``; their ids are in ``tca_mj.registry``."""
