"""Policies: who acts, what it is made of, and its file; beside them those that come with tca_mj.

``gait`` and ``network`` act, ``files`` keeps them, ``actors`` finds them by name.
"""

from tca_mj.agents.policies.files import Origin, Policy, SavedPolicy, load_policy, shipped

__all__ = ["Origin", "Policy", "SavedPolicy", "load_policy", "shipped"]
