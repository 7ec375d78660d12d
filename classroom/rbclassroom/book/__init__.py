"""The whole course as web pages, which need neither a server nor a network."""
