"""Commands that measure the model: problems with known answers, accuracy, validation, stress, and the paper."""
