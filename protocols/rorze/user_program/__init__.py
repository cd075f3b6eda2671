"""The language of user programs: instructions, operands, assembler (RC-420 manual 15, 16, 20)."""
