"""Pictures: artists on axes that the caller owns, and figures as files."""
