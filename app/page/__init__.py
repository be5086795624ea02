"""The pane socket: state to messages, messages to the controller."""
