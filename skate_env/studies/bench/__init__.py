"""IceSkate and its peers, measured side by side: evaluations, steps, environments, learning."""
