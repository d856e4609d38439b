"""What is done to a data set, one shard at a time, without an engine that spreads the shards.

``image_gip.ray`` hands them to Ray. A shard depends on its pictures and on the options alone, has a
name that is known beforehand, and gets it when it is complete: it does not matter how often, where
and in which order shards are made.
"""
