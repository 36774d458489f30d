"""What every package stands on: arrays, units, words, errors, files, threads; imports nothing of ours."""
