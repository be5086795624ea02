"""One port: page, socket, viser; who may talk to it."""
