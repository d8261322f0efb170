"""Where shards are worked on; an engine maps a function over them and knows nothing of what it does."""
