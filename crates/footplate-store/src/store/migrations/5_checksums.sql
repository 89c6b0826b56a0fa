-- A checksum of each row (CRC-32 of the table's name and all other values), so that a value that damage has turned into
-- another possible one is noticed. Rows of older programs have none.
ALTER TABLE events ADD COLUMN crc32 INTEGER CHECK (crc32 BETWEEN 0 AND 4294967295);
ALTER TABLE inputs ADD COLUMN crc32 INTEGER CHECK (crc32 BETWEEN 0 AND 4294967295);
ALTER TABLE decisions ADD COLUMN crc32 INTEGER CHECK (crc32 BETWEEN 0 AND 4294967295);
