"""What a dataset costs before it is made: time, bytes and memory, from figures of each stage."""
