"""A dataset on disk: shards, images, hashes, verification."""
