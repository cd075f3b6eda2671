"""The one door to controllers: all that can be asked of a plant by any front end, with its rules.

Arguments and results are plain data: paths such as `/bodies/line1.3F`, rows of the command tables, records.
"""
