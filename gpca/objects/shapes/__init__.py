"""The shapes that come with the package, built from solids: no file and no download is needed for them."""
