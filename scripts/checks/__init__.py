"""Parts shared by the checks in scripts/."""
