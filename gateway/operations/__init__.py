"""All that any front end can ask of a plant, with its rules.

Arguments and results are plain data: paths such as `/bodies/line1.3F`, rows of the command tables, records.
"""
