"""The types of DI 1.04 and Robotics 1.01.2 as published; their licence (MIT) stands in each."""
