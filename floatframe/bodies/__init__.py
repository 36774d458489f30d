"""Bodies and the places on them: rigid, flexible, ground; markers; mass properties."""
