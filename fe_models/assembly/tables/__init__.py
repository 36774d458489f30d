"""Tables that describe a model: materials, sections, attachments, places, as files and Python give them."""
