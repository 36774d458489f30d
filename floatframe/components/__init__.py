"""Components: elements that are built on the model alone, such as tyres, rails, drives and hydraulics."""
