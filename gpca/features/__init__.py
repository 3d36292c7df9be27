"""What can be measured of a pair of clouds after ICP, without knowing what happened to it."""
