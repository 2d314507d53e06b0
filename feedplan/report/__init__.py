"""The report of a plan: its figures, and the page that shows them."""
