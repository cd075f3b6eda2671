"""Operations on bodies, groups and their lines that take the plant."""
