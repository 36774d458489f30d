"""A four-bar linkage with a straight path and its design, as files."""
