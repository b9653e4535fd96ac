BEGIN TRANSACTION;
CREATE TABLE alembic_version (
	version_num VARCHAR(32) NOT NULL, 
	CONSTRAINT alembic_version_pkc PRIMARY KEY (version_num)
);
INSERT INTO "alembic_version" VALUES('v1');
CREATE TABLE audit (
	id INTEGER NOT NULL, 
	at TEXT NOT NULL, 
	person TEXT NOT NULL, 
	login TEXT NOT NULL, 
	action TEXT NOT NULL, 
	subject TEXT NOT NULL, 
	content TEXT NOT NULL, 
	previous TEXT NOT NULL, 
	sha256 TEXT NOT NULL, 
	PRIMARY KEY (id), 
	CONSTRAINT audit_previous UNIQUE (previous)
);
INSERT INTO "audit" VALUES(1,'2026-11-23T16:26:50.986545Z','operator','','enter','campaign c38ed1fa758d0535ccd819258f751c7afe76621611c9a664bb18775ed9a9a278','{"cell": "plant/cell-1", "facts": ["robot: UR10e, R-cell-1", "controller: CB5, C-cell-1", "firmware: 5.11", "safety_checksum: A1B2", "tool: gripper", "program: pick 3", "covers: none", "device: PFMD, D1"], "folder": "/plant/cell-1", "rows": {"campaigns": [1, "769fe88adbaea213683f53e962dfee8eee310e3021afd8b6d03e5cc122daaecf"], "cells": [1, "74a7d66d397fa623b7393cc4859e4c8cb32311182ae0a88a83d9d9a3e90e6fb1"], "facts": [8, "759ea745e4adda710938940d3afbe331594e724c63a25341f28888bd35a1c54d"], "impacts": [30, "701eee634bfec2ef5838821f5e20c6ed92e662057cbea4bde97c05f333425087"], "recordings": [30, "625d0d3d9d5b4bf02fcddfb062e6a23603643d128e0c89c59afe9b5b4d410d70"], "uses": [30, "cd7864bedd9b99382f682db6b20d2ad8f0114496945e985b2bb572c16b3410e2"]}}','0000000000000000000000000000000000000000000000000000000000000000','f5cfaadeb06c4f2cb07c79c5ab7995b04ed2978fd3efe8c5de2d3377375b228c');
INSERT INTO "audit" VALUES(2,'2026-11-23T16:26:51.119687Z','operator','','enter','more','{"rows": {"maps": [1, "5060aa49d9996ee52e8dd5fba0278e0c9e44d56986bfdf26c419143502ce9c71"]}}','f5cfaadeb06c4f2cb07c79c5ab7995b04ed2978fd3efe8c5de2d3377375b228c','79cbc6b49c667c2a863128a7c6e7a282d866a1b342f7b4bf1d113b42c240a25e');
INSERT INTO "audit" VALUES(3,'2026-11-23T16:26:51.217540Z','operator','','release','release 1','{"rows": {"releases": [1, "1ce532b7782e0cab0a25d28239b58d482e749ce5ddf1d0fab5ce996866ba255a"]}}','79cbc6b49c667c2a863128a7c6e7a282d866a1b342f7b4bf1d113b42c240a25e','602617e862f11216163a5b8a97915751d1f94437e80a751ddd98a6c042518ac3');
INSERT INTO "audit" VALUES(4,'2026-11-23T16:26:51.256188Z','operator','','withdraw','release 1','{"reason": "x", "rows": {"withdrawals": [1, "db5f5c390c5beb7f664ff8d2d24325f4b8a855498b9957055f240a6652913e02"]}}','602617e862f11216163a5b8a97915751d1f94437e80a751ddd98a6c042518ac3','cebcf5d9f9ff516f7230830b0987d0f40de99574ed451eb7b9089940f25b794e');
CREATE TABLE campaigns (
	id INTEGER NOT NULL, 
	cell_id INTEGER, 
	sha256 TEXT NOT NULL, 
	name TEXT NOT NULL, 
	folder TEXT NOT NULL, 
	binding TEXT NOT NULL, 
	conditions TEXT NOT NULL, 
	device TEXT NOT NULL, 
	measured_on TEXT, 
	calibrated TEXT, 
	calibrated_until TEXT, 
	"device_error_N" FLOAT, 
	simulated INTEGER NOT NULL, 
	recordings INTEGER NOT NULL, 
	entry INTEGER NOT NULL, 
	PRIMARY KEY (id), 
	CONSTRAINT campaigns_content UNIQUE (sha256, cell_id), 
	FOREIGN KEY(cell_id) REFERENCES cells (id), 
	FOREIGN KEY(entry) REFERENCES audit (id)
);
INSERT INTO "campaigns" VALUES(1,1,'c38ed1fa758d0535ccd819258f751c7afe76621611c9a664bb18775ed9a9a278','cell-1','/plant/cell-1','bound','{"robot": "UR10e, R-cell-1", "controller": "CB5, C-cell-1", "firmware": "5.11", "safety_checksum": "A1B2", "tool": "gripper", "program": "pick 3", "covers": "none", "device": "PFMD, D1"}','PFMD, D1','2026-02-01','2025-07-01','2026-07-01',3.0,0,30,1);
CREATE TABLE cells (
	id INTEGER NOT NULL, 
	site TEXT NOT NULL, 
	name TEXT NOT NULL, 
	entry INTEGER NOT NULL, 
	PRIMARY KEY (id), 
	CONSTRAINT cells_name UNIQUE (site, name), 
	FOREIGN KEY(entry) REFERENCES audit (id)
);
INSERT INTO "cells" VALUES(1,'plant','cell-1',1);
CREATE TABLE facts (
	id INTEGER NOT NULL, 
	cell_id INTEGER NOT NULL, 
	campaign_id INTEGER, 
	kind TEXT NOT NULL, 
	since TEXT NOT NULL, 
	value TEXT, 
	entry INTEGER NOT NULL, 
	PRIMARY KEY (id), 
	FOREIGN KEY(cell_id) REFERENCES cells (id), 
	FOREIGN KEY(campaign_id) REFERENCES campaigns (id), 
	FOREIGN KEY(entry) REFERENCES audit (id)
);
INSERT INTO "facts" VALUES(1,1,1,'robot','2026-02-01T23:59:59.999999Z','UR10e, R-cell-1',1);
INSERT INTO "facts" VALUES(2,1,1,'controller','2026-02-01T23:59:59.999999Z','CB5, C-cell-1',1);
INSERT INTO "facts" VALUES(3,1,1,'firmware','2026-02-01T23:59:59.999999Z','5.11',1);
INSERT INTO "facts" VALUES(4,1,1,'safety_checksum','2026-02-01T23:59:59.999999Z','A1B2',1);
INSERT INTO "facts" VALUES(5,1,1,'tool','2026-02-01T23:59:59.999999Z','gripper',1);
INSERT INTO "facts" VALUES(6,1,1,'program','2026-02-01T23:59:59.999999Z','pick 3',1);
INSERT INTO "facts" VALUES(7,1,1,'covers','2026-02-01T23:59:59.999999Z','none',1);
INSERT INTO "facts" VALUES(8,1,1,'device','2026-02-01T23:59:59.999999Z','PFMD, D1',1);
CREATE TABLE impacts (
	id INTEGER NOT NULL, 
	recording_id INTEGER NOT NULL, 
	campaign_id INTEGER NOT NULL, 
	curve TEXT NOT NULL, 
	state_id TEXT NOT NULL, 
	use TEXT NOT NULL, 
	flags TEXT NOT NULL, 
	distance_m FLOAT, 
	height_m FLOAT, 
	speed_mps FLOAT, 
	"peak_force_N" FLOAT, 
	"phase2_force_N" FLOAT, 
	"largest_N" FLOAT, 
	repeat INTEGER NOT NULL, 
	whole INTEGER NOT NULL, 
	entry INTEGER NOT NULL, 
	PRIMARY KEY (id), 
	FOREIGN KEY(recording_id) REFERENCES recordings (id), 
	FOREIGN KEY(campaign_id) REFERENCES campaigns (id), 
	FOREIGN KEY(entry) REFERENCES audit (id)
);
INSERT INTO "impacts" VALUES(1,1,1,'','s00','used','',0.52,0.14,0.15,200.19,1.6,200.19,1,1,1);
INSERT INTO "impacts" VALUES(2,2,1,'','s01','used','',0.52,0.14,0.25,279.71,1.6,279.71,1,1,1);
INSERT INTO "impacts" VALUES(3,3,1,'','s02','used','',0.52,0.14,0.35,358.01,1.6,358.01,1,1,1);
INSERT INTO "impacts" VALUES(4,4,1,'','s03','used','',0.56,0.29,0.15,141.37,1.6,141.37,1,1,1);
INSERT INTO "impacts" VALUES(5,5,1,'','s04','used','',0.56,0.29,0.25,200.49,1.6,200.49,1,1,1);
INSERT INTO "impacts" VALUES(6,6,1,'','s05','used','',0.56,0.29,0.35,255.88,1.6,255.88,1,1,1);
INSERT INTO "impacts" VALUES(7,7,1,'','s06','used','',0.6,0.44,0.15,98.77,1.6,98.77,1,1,1);
INSERT INTO "impacts" VALUES(8,8,1,'','s07','used','',0.6,0.44,0.25,143.12,1.6,143.12,1,1,1);
INSERT INTO "impacts" VALUES(9,9,1,'','s08','used','',0.6,0.44,0.35,179.17,1.6,179.17,1,1,1);
INSERT INTO "impacts" VALUES(10,10,1,'','s09','used','',0.64,0.24,0.15,134.05,1.6,134.05,1,1,1);
INSERT INTO "impacts" VALUES(11,11,1,'','s10','used','',0.64,0.24,0.25,194.98,1.6,194.98,1,1,1);
INSERT INTO "impacts" VALUES(12,12,1,'','s11','used','',0.64,0.24,0.35,255.82,1.6,255.82,1,1,1);
INSERT INTO "impacts" VALUES(13,13,1,'','s12','used','',0.68,0.39,0.15,98.02,1.6,98.02,1,1,1);
INSERT INTO "impacts" VALUES(14,14,1,'','s13','used','',0.68,0.39,0.25,138.98,1.6,138.98,1,1,1);
INSERT INTO "impacts" VALUES(15,15,1,'','s14','used','',0.68,0.39,0.35,188.74,1.6,188.74,1,1,1);
INSERT INTO "impacts" VALUES(16,16,1,'','s15','used','',0.72,0.19,0.15,123.93,1.6,123.93,1,1,1);
INSERT INTO "impacts" VALUES(17,17,1,'','s16','used','',0.72,0.19,0.25,175.5,1.6,175.5,1,1,1);
INSERT INTO "impacts" VALUES(18,18,1,'','s17','used','',0.72,0.19,0.35,237.89,1.6,237.89,1,1,1);
INSERT INTO "impacts" VALUES(19,19,1,'','s18','used','',0.76,0.34,0.15,89.21,1.6,89.21,1,1,1);
INSERT INTO "impacts" VALUES(20,20,1,'','s19','used','',0.76,0.34,0.25,135.33,1.6,135.33,1,1,1);
INSERT INTO "impacts" VALUES(21,21,1,'','s20','used','',0.76,0.34,0.35,179.54,1.6,179.54,1,1,1);
INSERT INTO "impacts" VALUES(22,22,1,'','s21','used','',0.8,0.14,0.15,107.75,1.6,107.75,1,1,1);
INSERT INTO "impacts" VALUES(23,23,1,'','s22','used','',0.8,0.14,0.25,159.61,1.6,159.61,1,1,1);
INSERT INTO "impacts" VALUES(24,24,1,'','s23','used','',0.8,0.14,0.35,225.22,1.6,225.22,1,1,1);
INSERT INTO "impacts" VALUES(25,25,1,'','s24','used','',0.84,0.29,0.15,84.21,1.6,84.21,1,1,1);
INSERT INTO "impacts" VALUES(26,26,1,'','s25','used','',0.84,0.29,0.25,128.41,1.6,128.41,1,1,1);
INSERT INTO "impacts" VALUES(27,27,1,'','s26','used','',0.84,0.29,0.35,168.74,1.6,168.74,1,1,1);
INSERT INTO "impacts" VALUES(28,28,1,'','s27','used','',0.88,0.44,0.15,68.3,1.6,68.3,1,1,1);
INSERT INTO "impacts" VALUES(29,29,1,'','s28','used','',0.88,0.44,0.25,107.83,1.6,107.83,1,1,1);
INSERT INTO "impacts" VALUES(30,30,1,'','s29','used','',0.88,0.44,0.35,149.96,1.6,149.96,1,1,1);
CREATE TABLE maps (
	id INTEGER NOT NULL, 
	campaign_id INTEGER NOT NULL, 
	sha256 TEXT NOT NULL, 
	file TEXT NOT NULL, 
	form TEXT NOT NULL, 
	entry INTEGER NOT NULL, 
	PRIMARY KEY (id), 
	FOREIGN KEY(campaign_id) REFERENCES campaigns (id), 
	FOREIGN KEY(entry) REFERENCES audit (id)
);
INSERT INTO "maps" VALUES(1,1,'abababababababababababababababababababababababababababababababab','maps/a.json','CFM_3D',2);
CREATE TABLE recordings (
	id INTEGER NOT NULL, 
	sha256 TEXT NOT NULL, 
	size_bytes BIGINT NOT NULL, 
	entry INTEGER NOT NULL, 
	PRIMARY KEY (id), 
	CONSTRAINT recordings_content UNIQUE (sha256), 
	FOREIGN KEY(entry) REFERENCES audit (id)
);
INSERT INTO "recordings" VALUES(1,'25028f42507c3ea5645152f0b12b217d012f55a64f31b36b9b404ae8e0eac6dd',9,1);
INSERT INTO "recordings" VALUES(2,'5e967171711f3a9b709afa1ee1fb9048c7842287006cd189525d2e09f52695ab',9,1);
INSERT INTO "recordings" VALUES(3,'c60513aefd35e5a1fb5096c152dc12451ac4463f0147e8a0c49a383b51651537',9,1);
INSERT INTO "recordings" VALUES(4,'4625afbf2aa208411e7975959f61282db8c698759cb5a7405a60fef9e3792994',9,1);
INSERT INTO "recordings" VALUES(5,'54c8fcd4717d0d07780a42b6266a540e8bbbe552c3663b18ac542204a0823577',9,1);
INSERT INTO "recordings" VALUES(6,'92c2355599d7878f31240474ad2fae0252d004fa8c2c073aad8ae4fe197dcff9',9,1);
INSERT INTO "recordings" VALUES(7,'1a26618bd0e437299a6aeff094f27ef90de177209ef4ababb4186c5d79a79e71',9,1);
INSERT INTO "recordings" VALUES(8,'03310e33a97f3d4e28891faafc2285e73c2d7d64cb1ea25bcd50374ed90e0d80',9,1);
INSERT INTO "recordings" VALUES(9,'b1d2acd0f737c969442f82bb03f1678c0fc15fa853516682aa65344d9e03921b',9,1);
INSERT INTO "recordings" VALUES(10,'492f55a6d59e131c3e0762bdad451aeffc3bac8e57696ee64413173cabebd981',9,1);
INSERT INTO "recordings" VALUES(11,'52c66b87772c9d6d22dd550fef709ce841a10dd2dd90e4a298ce9d079839df71',9,1);
INSERT INTO "recordings" VALUES(12,'6d7d95f66daf6eefbf77d5abae1ac8fdab72eee1b40d883aeed366ae08fed80e',9,1);
INSERT INTO "recordings" VALUES(13,'cd34f96a5b39400039327ed30070175b77f96a7da3f21746e1ca486c5371985a',9,1);
INSERT INTO "recordings" VALUES(14,'4389706d3ca67da8d3db4e9d2b519eac8fea5ce76797a005e359f554f0728f5c',9,1);
INSERT INTO "recordings" VALUES(15,'cd138d5f8a45af491ad8fe9d1d4db687d070e5e8b2eb92b1e25f4f06e13d7e8c',9,1);
INSERT INTO "recordings" VALUES(16,'0d7015968f5816eefc87f5fd7cb3ff75894a1b839630344caf2fc0c2c14f0b2b',9,1);
INSERT INTO "recordings" VALUES(17,'0410c6913305fc7f2c5b103b5d455c8f90985cb6d78a1ae49c58e557b3f0dec8',9,1);
INSERT INTO "recordings" VALUES(18,'ad27cedc2897853563d9c75e40793df5456b1a53a8403c83c10f8a9fc3a8efec',9,1);
INSERT INTO "recordings" VALUES(19,'4c17ca6a2748dbc8797a67f16801db3da463d438303716c8a07b35ff6c099409',9,1);
INSERT INTO "recordings" VALUES(20,'de79ddc7b08e38bf2f0e9a5a668dfe361ff2da616c17626aea5a7d87aee6550a',9,1);
INSERT INTO "recordings" VALUES(21,'f70d5b004f104b3fccf77117c54b1f60164f8c87caaeac53ded633536f18f389',9,1);
INSERT INTO "recordings" VALUES(22,'4a900707aed8b6332b62dfb08e166107aaecdf701d06b7784804fa5b303df39b',9,1);
INSERT INTO "recordings" VALUES(23,'1a6b2ea1b675e79b09c06a08d9fec684e62e6cca2237c7b036413be10818ff95',9,1);
INSERT INTO "recordings" VALUES(24,'80714d4155802d78f56cb656e04bf9f8ccaece2affc516243c2f2d6b0eafe6f4',9,1);
INSERT INTO "recordings" VALUES(25,'8a654693aa51c3c689c250a81aad712d5b87af772518a67e2ad7ec391f17d06f',9,1);
INSERT INTO "recordings" VALUES(26,'b7344969858798773153deea8f46b97c1736289c139f651f1c98c5510c6a5d2d',9,1);
INSERT INTO "recordings" VALUES(27,'7c5bfb6a0a17c6caca439c7de7c2c22d8558ef5abead1cc7f72522708a0090a3',9,1);
INSERT INTO "recordings" VALUES(28,'f5a833d7c4d23cc7012f02b588dcf94f1eb114afff446178bf56d646c9ecb2cc',9,1);
INSERT INTO "recordings" VALUES(29,'38d50ec028ea36d57757c85cfccba55c60b7de9eb547382f5cd9543e23079344',9,1);
INSERT INTO "recordings" VALUES(30,'9e4bf8f3d77e60831c50dd3532e5dc43d01dfc30ba7b88772dd3c89897a8769a',9,1);
CREATE TABLE releases (
	id INTEGER NOT NULL, 
	cell_id INTEGER NOT NULL, 
	campaign_id INTEGER NOT NULL, 
	subject TEXT NOT NULL, 
	areas TEXT NOT NULL, 
	contact TEXT NOT NULL, 
	bound TEXT NOT NULL, 
	speeds TEXT NOT NULL, 
	report_sha256 TEXT NOT NULL, 
	conditions TEXT NOT NULL, 
	person TEXT NOT NULL, 
	at TEXT NOT NULL, 
	map_sha256 TEXT, 
	valid_until TEXT, 
	measured_on TEXT, 
	calibrated TEXT, 
	calibrated_until TEXT, 
	"limit_N" FLOAT, 
	"device_spring_N_per_m" FLOAT, 
	"area_spring_N_per_m" FLOAT, 
	simulated INTEGER NOT NULL, 
	replaces INTEGER, 
	entry INTEGER NOT NULL, 
	PRIMARY KEY (id), 
	CONSTRAINT releases_replaces UNIQUE (replaces), 
	FOREIGN KEY(cell_id) REFERENCES cells (id), 
	FOREIGN KEY(campaign_id) REFERENCES campaigns (id), 
	FOREIGN KEY(replaces) REFERENCES releases (id), 
	FOREIGN KEY(entry) REFERENCES audit (id)
);
INSERT INTO "releases" VALUES(1,1,1,'workspace','chest','transient','b','{}','0000000000000000000000000000000000000000000000000000000000000000','{"controller": "CB5, C-cell-1", "covers": "none", "device": "PFMD, D1", "firmware": "5.11", "program": "pick 3", "robot": "UR10e, R-cell-1", "safety_checksum": "A1B2", "tool": "gripper"}','operator','2026-11-23T16:26:51.217540Z','abababababababababababababababababababababababababababababababab','2027-09-19','2026-02-01',NULL,'2026-12-31',280.0,75000.0,25000.0,0,NULL,3);
CREATE TABLE uses (
	id INTEGER NOT NULL, 
	campaign_id INTEGER NOT NULL, 
	impact_id INTEGER NOT NULL, 
	file TEXT NOT NULL, 
	entry INTEGER NOT NULL, 
	PRIMARY KEY (id), 
	FOREIGN KEY(campaign_id) REFERENCES campaigns (id), 
	FOREIGN KEY(impact_id) REFERENCES impacts (id), 
	FOREIGN KEY(entry) REFERENCES audit (id)
);
INSERT INTO "uses" VALUES(1,1,1,'s00-r1.csv',1);
INSERT INTO "uses" VALUES(2,1,2,'s01-r1.csv',1);
INSERT INTO "uses" VALUES(3,1,3,'s02-r1.csv',1);
INSERT INTO "uses" VALUES(4,1,4,'s03-r1.csv',1);
INSERT INTO "uses" VALUES(5,1,5,'s04-r1.csv',1);
INSERT INTO "uses" VALUES(6,1,6,'s05-r1.csv',1);
INSERT INTO "uses" VALUES(7,1,7,'s06-r1.csv',1);
INSERT INTO "uses" VALUES(8,1,8,'s07-r1.csv',1);
INSERT INTO "uses" VALUES(9,1,9,'s08-r1.csv',1);
INSERT INTO "uses" VALUES(10,1,10,'s09-r1.csv',1);
INSERT INTO "uses" VALUES(11,1,11,'s10-r1.csv',1);
INSERT INTO "uses" VALUES(12,1,12,'s11-r1.csv',1);
INSERT INTO "uses" VALUES(13,1,13,'s12-r1.csv',1);
INSERT INTO "uses" VALUES(14,1,14,'s13-r1.csv',1);
INSERT INTO "uses" VALUES(15,1,15,'s14-r1.csv',1);
INSERT INTO "uses" VALUES(16,1,16,'s15-r1.csv',1);
INSERT INTO "uses" VALUES(17,1,17,'s16-r1.csv',1);
INSERT INTO "uses" VALUES(18,1,18,'s17-r1.csv',1);
INSERT INTO "uses" VALUES(19,1,19,'s18-r1.csv',1);
INSERT INTO "uses" VALUES(20,1,20,'s19-r1.csv',1);
INSERT INTO "uses" VALUES(21,1,21,'s20-r1.csv',1);
INSERT INTO "uses" VALUES(22,1,22,'s21-r1.csv',1);
INSERT INTO "uses" VALUES(23,1,23,'s22-r1.csv',1);
INSERT INTO "uses" VALUES(24,1,24,'s23-r1.csv',1);
INSERT INTO "uses" VALUES(25,1,25,'s24-r1.csv',1);
INSERT INTO "uses" VALUES(26,1,26,'s25-r1.csv',1);
INSERT INTO "uses" VALUES(27,1,27,'s26-r1.csv',1);
INSERT INTO "uses" VALUES(28,1,28,'s27-r1.csv',1);
INSERT INTO "uses" VALUES(29,1,29,'s28-r1.csv',1);
INSERT INTO "uses" VALUES(30,1,30,'s29-r1.csv',1);
CREATE TABLE withdrawals (
	id INTEGER NOT NULL, 
	release_id INTEGER NOT NULL, 
	reason TEXT NOT NULL, 
	person TEXT NOT NULL, 
	at TEXT NOT NULL, 
	entry INTEGER NOT NULL, 
	PRIMARY KEY (id), 
	FOREIGN KEY(release_id) REFERENCES releases (id), 
	FOREIGN KEY(entry) REFERENCES audit (id)
);
INSERT INTO "withdrawals" VALUES(1,1,'x','operator','2026-11-23T16:26:51.256188Z',4);
CREATE INDEX campaigns_cell ON campaigns (cell_id);
CREATE INDEX facts_cell ON facts (cell_id, kind);
CREATE INDEX facts_value ON facts (kind, value);
CREATE INDEX impacts_recording ON impacts (recording_id);
CREATE INDEX uses_campaign ON uses (campaign_id);
CREATE INDEX uses_impact ON uses (impact_id);
CREATE INDEX maps_sha256 ON maps (sha256);
CREATE INDEX releases_cell ON releases (cell_id);
CREATE INDEX releases_map ON releases (map_sha256);
CREATE INDEX withdrawals_release ON withdrawals (release_id);
CREATE TRIGGER audit_kept_update before update on audit begin select raise(abort, 'a row of the register is never changed or deleted; enter what is new'); end;
CREATE TRIGGER audit_kept_delete before delete on audit begin select raise(abort, 'a row of the register is never changed or deleted; enter what is new'); end;
CREATE TRIGGER audit_kept_insert before insert on audit when exists (select 1 from audit where id = new.id) begin select raise(abort, 'a row of the register is never changed or deleted; enter what is new'); end;
CREATE TRIGGER cells_kept_update before update on cells begin select raise(abort, 'a row of the register is never changed or deleted; enter what is new'); end;
CREATE TRIGGER cells_kept_delete before delete on cells begin select raise(abort, 'a row of the register is never changed or deleted; enter what is new'); end;
CREATE TRIGGER campaigns_kept_update before update on campaigns begin select raise(abort, 'a row of the register is never changed or deleted; enter what is new'); end;
CREATE TRIGGER campaigns_kept_delete before delete on campaigns begin select raise(abort, 'a row of the register is never changed or deleted; enter what is new'); end;
CREATE TRIGGER facts_kept_update before update on facts begin select raise(abort, 'a row of the register is never changed or deleted; enter what is new'); end;
CREATE TRIGGER facts_kept_delete before delete on facts begin select raise(abort, 'a row of the register is never changed or deleted; enter what is new'); end;
CREATE TRIGGER recordings_kept_update before update on recordings begin select raise(abort, 'a row of the register is never changed or deleted; enter what is new'); end;
CREATE TRIGGER recordings_kept_delete before delete on recordings begin select raise(abort, 'a row of the register is never changed or deleted; enter what is new'); end;
CREATE TRIGGER recordings_kept_insert before insert on recordings when exists (select 1 from recordings where sha256 = new.sha256) begin select raise(abort, 'a row of the register is never changed or deleted; enter what is new'); end;
CREATE TRIGGER impacts_kept_update before update on impacts begin select raise(abort, 'a row of the register is never changed or deleted; enter what is new'); end;
CREATE TRIGGER impacts_kept_delete before delete on impacts begin select raise(abort, 'a row of the register is never changed or deleted; enter what is new'); end;
CREATE TRIGGER impacts_kept_insert before insert on impacts when exists (select 1 from impacts where id = new.id) begin select raise(abort, 'a row of the register is never changed or deleted; enter what is new'); end;
CREATE TRIGGER uses_kept_update before update on uses begin select raise(abort, 'a row of the register is never changed or deleted; enter what is new'); end;
CREATE TRIGGER uses_kept_delete before delete on uses begin select raise(abort, 'a row of the register is never changed or deleted; enter what is new'); end;
CREATE TRIGGER maps_kept_update before update on maps begin select raise(abort, 'a row of the register is never changed or deleted; enter what is new'); end;
CREATE TRIGGER maps_kept_delete before delete on maps begin select raise(abort, 'a row of the register is never changed or deleted; enter what is new'); end;
CREATE TRIGGER releases_kept_update before update on releases begin select raise(abort, 'a row of the register is never changed or deleted; enter what is new'); end;
CREATE TRIGGER releases_kept_delete before delete on releases begin select raise(abort, 'a row of the register is never changed or deleted; enter what is new'); end;
CREATE TRIGGER releases_kept_insert before insert on releases when exists (select 1 from releases where id = new.id) begin select raise(abort, 'a row of the register is never changed or deleted; enter what is new'); end;
CREATE TRIGGER withdrawals_kept_update before update on withdrawals begin select raise(abort, 'a row of the register is never changed or deleted; enter what is new'); end;
CREATE TRIGGER withdrawals_kept_delete before delete on withdrawals begin select raise(abort, 'a row of the register is never changed or deleted; enter what is new'); end;
CREATE TRIGGER withdrawals_kept_insert before insert on withdrawals when exists (select 1 from withdrawals where id = new.id) begin select raise(abort, 'a row of the register is never changed or deleted; enter what is new'); end;
COMMIT;
