"""Operations on SCARA robots."""
