"""Commands that measure: problems with known answers, accuracy, validation, stress, the paper."""
