"""The problems: answers, inputs, and common mistakes with their hints."""
