"""The whole course as pages that open without a server and without a network."""
