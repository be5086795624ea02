"""The command for many recordings: its workers, job arrays and clusters, and the table of the morning after."""
