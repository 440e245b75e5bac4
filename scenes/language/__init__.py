"""The languages of the pages: English in the code, a catalogue for each of the others."""
