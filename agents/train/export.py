"""The actor of Stable-Baselines3 as a ``Network``: what it does without noise, in plain numbers."""

from typing import Any

import numpy as np
import torch
from stable_baselines3 import PPO, SAC, TD3
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.vec_env import VecNormalize

from tca_mj.agents.policies.network import Network


def exported(model: BaseAlgorithm, normalise: VecNormalize) -> Network:
    """The deterministic policy of a model.

    Args:
        model: PPO, SAC or TD3 with a multi-layer perceptron, and actions between -1 and 1.
        normalise: What normalises its observations.

    Raises:
        ValueError: If the model is another one.
    """
    policy: Any = model.policy
    if isinstance(model, PPO):
        actor, squash = [policy.mlp_extractor.policy_net, policy.action_net], "clip"
    elif isinstance(model, SAC):
        actor, squash = [policy.actor.latent_pi, policy.actor.mu], "tanh"
    elif isinstance(model, TD3):
        actor, squash = [policy.actor.mu], "tanh"
    else:
        raise ValueError(f"model must be PPO, SAC or TD3, got {type(model).__name__}")
    space: Any = model.action_space
    if not (np.all(space.low == -1.0) and np.all(space.high == 1.0)):
        raise ValueError(f"actions must lie between -1 and 1, got {space}")
    parts = [part for module in actor for part in module.modules()]
    layers: list[Any] = [part for part in parts if isinstance(part, torch.nn.Linear)]
    relu = any(isinstance(part, torch.nn.ReLU) for part in parts)
    statistics: Any = normalise.obs_rms
    return Network(
        weights=tuple(layer.weight.detach().numpy().copy() for layer in layers),
        biases=tuple(layer.bias.detach().numpy().copy() for layer in layers),
        mean=statistics.mean.copy(),
        var=statistics.var.copy(),
        clip=float(normalise.clip_obs),
        epsilon=float(normalise.epsilon),
        activation="relu" if relu else "tanh",
        squash=squash,
    )
