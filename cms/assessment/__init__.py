"""Assessment: quality of a reduced body, comparison of mode sets, correlation with tests, reports and pictures."""
