"""Stage 2: what the logged signals establish of the controller without a model of the robot."""
