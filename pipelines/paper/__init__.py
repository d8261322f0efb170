"""The paper, reproduced claim by claim, and what goes beyond it."""
