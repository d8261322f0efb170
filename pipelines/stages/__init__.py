"""The stages of a run: generate, detect, estimate, score; and what other systems' poses need to join them."""
