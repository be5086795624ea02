"""Who may change the state: the controller and its parts, one room per kind of intention."""
